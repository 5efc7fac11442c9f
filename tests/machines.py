"""Machines that several test files run."""

PERPENDICULAR = """
[incoming]
speed = 2.0
pulley_radius = 0.1
[plate]
distance = 0.5
[outgoing]
drop = 0.5
"""
