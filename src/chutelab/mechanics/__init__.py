"""Flight, impact and ride: numbers or arrays in, the same out.

- `ballistics`: flight under gravity, and when it crosses a line.
- `contact`: a blow's impulses; a ride round a circle: grip, slip, when the contact opens.
"""
