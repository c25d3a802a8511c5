"""Pictures and animations of mechanisms, and the command ``draw_mechanism`` that saves them."""
