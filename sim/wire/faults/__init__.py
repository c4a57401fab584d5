"""What goes wrong on a simulated camera's wire: when, and what it does to units and connections."""
