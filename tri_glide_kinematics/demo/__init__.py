"""Demo: a simulated machine is driven over the topics, measured and judged."""
