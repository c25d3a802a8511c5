"""Motion along a path in nearly the least time that the limits allow."""
