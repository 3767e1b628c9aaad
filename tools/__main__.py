"""`python -m openpendant.tools`: the command `openpendant`, where no script is on the path."""

from .cli import main

raise SystemExit(main())
