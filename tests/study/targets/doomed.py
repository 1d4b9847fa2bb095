"""A target whose import ends the process without a word."""

import os

os._exit(3)
