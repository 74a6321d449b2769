"""The IK node in the locale of its environment; Python by itself takes only the characters from there."""

from __future__ import annotations

import locale
import sys

from ros_ik_pkg.ros import ik_node


def main() -> int:
    """Set the locale, say how it writes a half, and run the node."""
    print(f'locale: {locale.setlocale(locale.LC_ALL, "")} writes {locale.str(0.5)}', flush=True)
    return ik_node.main()


if __name__ == '__main__':
    sys.exit(main())
