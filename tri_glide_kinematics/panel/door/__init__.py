"""Who may speak to the page: hosts, origins and the token."""
