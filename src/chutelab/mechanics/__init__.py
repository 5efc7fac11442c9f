"""Kinematics, impacts and rides: numbers or arrays in, the same out.

- `ballistics`: flight under gravity, and when it crosses a line.
- `impact`: the impulses of a blow: Newton restitution and Coulomb friction.
- `ride`: a ride round a circle under friction: grip, slip, when the contact opens.
"""
