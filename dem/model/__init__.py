"""What a run changes: state, joints, shapes, ties, and its steps."""
