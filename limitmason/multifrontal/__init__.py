"""Multifrontal elimination of sparse symmetric matrices: order, fronts, and what all factors of one pattern share."""
