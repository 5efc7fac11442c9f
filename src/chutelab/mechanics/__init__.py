"""Kinematics, impact and the ride round a pulley: numbers or arrays in, the same out."""
