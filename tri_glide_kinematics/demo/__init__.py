"""Demonstration: a simulated machine is driven over the topics, measured, judged and drawn."""
