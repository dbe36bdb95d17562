"""Start the window: ``python -m flyreg_gui``."""

import sys

from flyreg_gui.main import main

if __name__ == "__main__":
    sys.exit(main())
