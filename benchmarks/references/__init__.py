"""What the figures are compared to, each as fast as its plain form allows, without checks."""
