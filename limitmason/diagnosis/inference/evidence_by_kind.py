"""Evidence by kind: how much of an effect each kind of data shows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from limitmason.diagnosis.inference.design import Design

AGREE = 0.0455  # tail probability of shares that differ more: two standard errors between two kinds
ROUGH = 0.02  # of the effect: what a share may be off where the effect is far from linear in its size
UNFELT = 10.0  # standard error of a share above which a kind says nothing of an effect
SEEN = 2.0  # standard errors by which a kind must show an effect
TESTED = 1.0 / 3.0  # standard error of a share up to which a kind can tell the whole effect from none
ABSENT = 3.0  # standard errors by which the share of a tested kind then lies below one


@dataclass(frozen=True)
class Evidence:
    r"""What one kind of data says of an explanation.

    With f the fitted effect on the rows of this kind, y their data from the baseline, C the correlation of their noise
    and J the change of the baseline per standard deviation of each measured input,

    .. math:: a = \frac{f' W y}{f' W f}, \qquad W = (C + J J')^{-1}, \qquad \mathrm{error} = (f' W f)^{-1/2}

    Parameters
    ----------
    kind : of the data
    gain : log-likelihood that the explanation gains on these rows; below 0 it makes them worse
    share, error : a and its standard error: 1 is the whole fitted effect, 0 none of it
    misfit : root mean square of the baseline's residuals in units of the noise; 1 is noise alone
    """

    kind: str
    gain: float
    share: float
    error: float
    misfit: float

    @property
    def tested(self) -> bool:
        """Whether this kind can tell the whole effect from none."""
        return self.error <= TESTED

    @property
    def shows(self) -> bool:
        """Whether the effect is seen in it."""
        return self.share >= SEEN * self.error

    @property
    def whole(self) -> bool:
        """Whether the whole effect is seen, within two standard errors."""
        return self.shows and abs(1.0 - self.share) <= SEEN * self.error

    @property
    def absent(self) -> bool:
        """Whether the effect should show here and does not: this rejects the explanation."""
        return self.tested and not self.shows and 1.0 - self.share > ABSENT * self.error


def agree(kinds: Sequence[Evidence]) -> bool:
    """Whether two kinds or more show an effect, of sizes that predict the others."""
    known = [k for k in kinds if k.tested or k.shows]
    if sum(k.shows for k in known) < 2:
        return False
    share, weight = np.array([k.share for k in known]), np.array([1.0 / (k.error**2 + ROUGH**2) for k in known])
    apart = float((weight * (share - np.average(share, weights=weight)) ** 2).sum())
    return bool(chdtrc(len(known) - 1, apart) >= AGREE)


def predicted_evidence(kind: str, effect: np.ndarray, about: np.ndarray, data: np.ndarray) -> Evidence:
    """Evidence of values that an explanation predicted before they were measured.

    Parameters
    ----------
    effect : predicted change of the values from the baseline, in units of their noise, shape (n,)
    about : directions in which prediction and baseline are uncertain, one standard deviation each, shape (n, k)
    data : measured values from the baseline, in units of their noise, shape (n,)
    """
    # W f and W y, with W = (I + A A')^-1 and A the uncertain directions
    weighted = np.linalg.solve(np.eye(len(data)) + about @ about.T, np.column_stack([effect, data]))
    reach = float(effect @ weighted[:, 0])
    share, error = (float(effect @ weighted[:, 1]) / reach, reach**-0.5) if reach > UNFELT**-2 else (0.0, np.inf)
    left = data - effect
    gain = 0.5 * float(data @ weighted[:, 1] - left @ (weighted[:, 1] - weighted[:, 0]))
    misfit = float(np.sqrt(np.mean(data**2)))
    return Evidence(kind=kind, gain=gain, share=share, error=error, misfit=misfit)


def by_kind(
    design: Design, effect: np.ndarray, y: np.ndarray, before: np.ndarray, after: np.ndarray, sd: float = 1.0
) -> tuple[Evidence, ...]:
    """Evidence of every kind of data for an explanation.

    Parameters
    ----------
    effect : of the fitted explanation, in the coordinates of the design, shape (n,); zeros for the baseline, of which
        only the misfit is told
    y : whitened data, per specimen, shape (n,)
    before, after : residuals of the baseline and of the explanation, in the coordinates of the design, shape (n,)
    sd : noise in stated units
    """
    kinds = design.kinds or ("",) * design.n
    apart = design.apart
    mix = design.mix
    slopes = apart((design.null.slopes / sd).T).T
    effect = apart(effect)
    # each row's part of r' C^-1 r / sd^2, before and after
    squares = [apart(r) * (r if mix is None else mix.T @ r) / sd**2 for r in (before, after)]
    out = []
    for kind in dict.fromkeys(kinds):
        rows = np.array([k == kind for k in kinds])
        j = slopes[rows]
        if mix is not None:
            weighted = np.linalg.solve(design.correlation[np.ix_(rows, rows)] + j @ j.T, effect[rows])
        else:  # (I + J J')^-1 by the inputs, which are few
            weighted = effect[rows] - j @ np.linalg.solve(np.eye(j.shape[1]) + j.T @ j, j.T @ effect[rows])
        reach = float(weighted @ effect[rows])  # f' W f: one over the variance of the share, where the noise is 1
        felt = reach * UNFELT**2 > sd**2
        share, error = (float(weighted @ y[rows]) / reach, sd / np.sqrt(reach)) if felt else (0.0, np.inf)
        gain = 0.5 * float((squares[0] - squares[1])[rows].sum())
        misfit = float(np.sqrt(np.mean(np.maximum(squares[0][rows], 0.0))))
        out.append(Evidence(kind=str(kind), gain=gain, share=share, error=float(error), misfit=misfit))
    return tuple(out)
