"""Scripted controllers to beat: each a policy with a few numbers that ``python -m training tune`` chooses.

One direction of imports: ``sensors <- controller <- gaits <- jam, reflex, follow <- catalogue``, and for the last,
``sensors <- chain, grip <- planner <- follow``.
"""
