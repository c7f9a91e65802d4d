"""`python -m rpf3d_ros.demo`: the demo of a shift."""

import sys

from rpf3d_ros.demo.run import main

if __name__ == "__main__":
    sys.exit(main())
