"""By how much the errors of a fit to legs are wider than the spread of its own windows says."""

from __future__ import annotations

from math import isfinite, sqrt


def inflation(fitted: float | None, left_out: float | None) -> float:
    """Return the factor on the standard errors, by how much worse a manoeuvre is predicted that was left out.

    Of few manoeuvres the spread that a covariance is made of is itself fitted away (MacKinnon & White 1985, "Some
    heteroskedasticity-consistent covariance matrix estimators", Journal of Econometrics 29).

    Parameters
    ----------
    fitted, left_out : float or None
        Mean squares over the windows of the fitted manoeuvres, by the parameters of all and by those of the others.

    Returns
    -------
    float
        No less than 1; 1 where a manoeuvre that is left out is not predicted at all.
    """
    return sqrt(max(left_out / fitted, 1.0)) if fitted and left_out and isfinite(left_out) else 1.0
