"""Colours and light of films, viewer and playground: one robot, one look. As a program it writes them for the page.

Robot, forces, trail and goal have colours of Okabe and Ito, which colour-blind people can tell apart.
"""

from __future__ import annotations

Colour = tuple[int, int, int]

BODY: tuple[Colour, Colour] = ((0, 158, 115), (0, 136, 99))
"""Of links in turn."""
HEAD: Colour = (230, 159, 0)
MARK: Colour = (240, 244, 238)
"""Of a stripe on the back of each link, which shows how a robot rolls."""
PEG: Colour = (140, 146, 154)
FORCE: Colour = (213, 94, 0)
SPRING: Colour = (86, 180, 233)
"""Of what pulls: springs of pegs that yield, and the one by which a hand pulls a robot."""
TRAIL: Colour = (0, 114, 178)
GOAL: Colour = (204, 121, 167)
GROUND: Colour = (244, 245, 242)
ICE: Colour = (190, 220, 236)
RUG: Colour = (216, 190, 160)
"""Patches without friction, and of very much, come near to these."""
EARTH: Colour = (196, 186, 164)
GRID: tuple[Colour, Colour] = ((228, 232, 226), (195, 201, 194))
"""Of lines every 10 cm and every metre."""

SUN = (-0.34, -0.42, 0.84)
"""Direction to the light, a unit vector."""
PEG_HEIGHT = 0.15
"""Of obstacles that have none: those of the plane, and those without end [m]."""
MARK_WIDTH = 0.3
"""Of the stripe on a link, in radii."""
SPRING_WIDTH = 0.014
"""Radius of the mark where a spring holds a peg [m]."""
FORCE_SCALE = 0.01
"""Length of an arrow [m/N]: 10 cm for 10 N."""
LONGEST_ARROW = 0.4
"""Arrows of larger forces are as long as this, with two heads [m]."""


def tint(factor: float) -> Colour:
    """Colour of a patch of the ground by its factor of friction."""
    far, share = (ICE, 1.0 - factor) if factor < 1.0 else (RUG, 1.0 - 1.0 / factor)
    red, green, blue = (round(own + share * (other - own)) for own, other in zip(GROUND, far, strict=True))
    return red, green, blue


def main() -> None:
    """Prints a module of JavaScript with colours, as 0xrrggbb, and sizes."""
    colours = {"BODY": BODY[0], "HEAD": HEAD, "MARK": MARK, "PEG": PEG, "FORCE": FORCE, "SPRING": SPRING}
    for name, colour in (colours | {"TRAIL": TRAIL, "GOAL": GOAL}).items():
        print(f"export const {name} = 0x{bytes(colour).hex()};")
    sizes = {"PEG_HEIGHT": PEG_HEIGHT, "MARK_WIDTH": MARK_WIDTH, "SPRING_WIDTH": SPRING_WIDTH}
    for name, size in (sizes | {"FORCE_SCALE": FORCE_SCALE, "LONGEST_ARROW": LONGEST_ARROW}).items():
        print(f"export const {name} = {size};")
    tints = ", ".join(f"{factor:g}: 0x{bytes(tint(factor)).hex()}" for factor in (0.1, 4.0))
    print(f"// Of patches, by their factor of friction.\nexport const TINT = {{{tints}}};")


if __name__ == "__main__":
    main()
