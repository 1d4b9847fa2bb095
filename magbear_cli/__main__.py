"""``python -m magbear_cli`` is the ``magbear`` command."""

from magbear_cli.cli.main import main

if __name__ == "__main__":
    main()
