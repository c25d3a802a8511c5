"""How fast this project is, always as a ratio to a reference measured in the same run.

``python -m benchmarks`` runs everything; ``docs/performance.md`` explains each reference.
"""
