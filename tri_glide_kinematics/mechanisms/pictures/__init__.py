"""Pictures of mechanisms, and the command that draws them."""
