"""Scenes that are hard on an engine, run on each under the laws of `chutelab.checks.stress`.

===============  ==================================================================================
`case`           `Case`: a scene, its engines and steps, and what is asked of it
`extremes`       speed, mass, materials and belts at their limits; what lasts, piles, coarse steps
`geometry`       grazing, critical speed, ends, corners, contact from the start
`cases`          all cases; far away, in a mirror, at ever smaller steps, drawn at random
`demands`        what single cases ask for besides the laws, one function each
`runs`           a case run within its time and judged; small runs, and spoilt ones
`test_cases`     every case, a test for each engine and step
`test_laws`      every law can fail
`test_parts`     so can those on arcs, gates, several sizes and pairs
`test_demands`   so can every demand, and the cases are all there
===============  ==================================================================================
"""
