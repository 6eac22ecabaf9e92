"""The commands of ``snake-env``, one module each with ``main(arguments) -> status``."""
