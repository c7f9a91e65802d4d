"""`python -m rpf3d_ros.demo`: run the demo, five minutes of a working shift in a mine."""

import sys

from rpf3d_ros.demo.run import main

if __name__ == "__main__":
    sys.exit(main())
