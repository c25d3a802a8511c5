"""Nodes: one module each."""
