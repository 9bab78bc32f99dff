"""The other rival without a name: low-order surfaces on the covariates by BIC, which the processes were held against.

A constant, with a line or a parabola along one covariate or a step per label, or with lines along two of them:

    log E(y) = max over the surfaces of -rss / 2 - (number of coefficients) log(n) / 2

G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6 (1978).
"""

from itertools import combinations

import numpy as np

from limitmason.diagnosis.inference.trends import is_numeric


def blocks(covariates):
    """Columns of every trend, by covariate: the first is the simplest."""
    out = {}
    for name, column in covariates.items():
        labels = sorted(set(map(str, column)))
        if is_numeric(column):
            x = np.asarray(column, dtype=float)
            if np.ptp(x) > 0:
                x = (x - x.mean()) / x.std()
                out[name] = [x[:, None]] + ([np.stack([x, x**2], axis=1)] if len(labels) > 2 else [])
        elif 1 < len(labels) < len(column):
            out[name] = [np.array([[float(str(v) == k) for k in labels[1:]] for v in column])]
    return out


class Surfaces:
    """All surfaces of a design.

    Parameters
    ----------
    design : tables with a known noise
    covariates : name to values of all specimens
    """

    def __init__(self, design, covariates):
        n, slopes = design.n, design.null.slopes
        weight = (np.mean(design.scale) / design.scale)[:, None]
        root = np.linalg.cholesky(np.linalg.inv(np.eye(n) + slopes @ slopes.T)).T  # measured inputs profiled out
        one, trends = np.ones((n, 1)), blocks(covariates)
        models = [np.zeros((n, 0)), one, *(np.hstack([one, b]) for part in trends.values() for b in part)]
        models += [np.hstack([one, a[0], b[0]]) for a, b in combinations(trends.values(), 2)]
        self.root, self.bases, self.price = root, [], 0.5 * np.log(n)
        for model in models:
            u, s, _ = np.linalg.svd(root @ (weight * model), full_matrices=False)
            self.bases.append(u[:, s > 1e-8])

    def evidence(self, y):
        """Of the best surface for one data set."""
        v = self.root @ y
        return max(-0.5 * float(v @ v - ((v @ b) ** 2).sum()) - self.price * b.shape[1] for b in self.bases)


def remainder(effect, covariates, leave=()):
    """Sum of squares that the best trend along one covariate leaves of an effect in units of the noise.

    What a design shows of an effect beyond anything that goes with one recorded quantity: whether its lever is varied.
    """
    one = np.ones((len(effect), 1))
    least = float(((effect - effect.mean()) ** 2).sum())
    for name, part in blocks(covariates).items():
        if name in leave:
            continue
        columns = np.hstack([one, part[-1]])
        left = effect - columns @ np.linalg.lstsq(columns, effect, rcond=None)[0]
        least = min(least, float(left @ left))
    return least
