"""Nodes: one module each, which turns messages into calls and results into messages."""
