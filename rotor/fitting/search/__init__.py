"""The least-squares search: residuals with derivatives, start values, strategies."""
