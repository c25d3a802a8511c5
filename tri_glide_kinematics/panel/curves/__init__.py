"""Curves: what the sliders did in the last seconds, beside their limits.

For other parts of the panel: ``Curves`` in ``plots``, ``CurveLimits`` in ``limits``.
"""
