"""Nodes as real processes, for tests, soaks and benchmarks: domains, processes, clients."""
