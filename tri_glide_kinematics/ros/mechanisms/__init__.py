"""Requests and answers about planar mechanisms as messages."""
