"""The viewer in the browser, on viser; needs the extra ``view``.

One direction of imports: ``frames <- drawing <- player, live, export``.
"""
