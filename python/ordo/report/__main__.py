"""python3 -m ordo.report: results as one page to look at."""

import argparse
import sys

from .._errors import InputError, OutputError
from . import write


def main():
    command = argparse.ArgumentParser(prog="python3 -m ordo.report", description="Writes the results of a run, or of `ordo verify --data`, as one page "
                                      "to look at in a browser, without network: case, energies, probes, particles that move.")
    command.add_argument("directory", help="the folder of results")
    command.add_argument("-o", "--output", metavar="FILE", help="the page; by default report.html in the folder")
    command.add_argument("--fields", metavar="NAME,..", type=lambda text: text.split(","), help="fields to show; by default all that were written")
    command.add_argument("--every", metavar="N", type=int, default=1, help="show each Nth frame, and the last")
    command.add_argument("--points", action="store_true", help="show particles as points, not as their domains")
    command.add_argument("--limit", metavar="MB", type=float, default=60, help="size of the page; above it numbers are coarser, then frames left out (60)")
    options = command.parse_args()
    try:
        output = write(**vars(options))
    except (InputError, ImportError) as e:
        print(f"ordo.report: {e}", file=sys.stderr)
        return 2
    except OutputError as e:
        print(f"ordo.report: {e}", file=sys.stderr)
        return 1
    print(f"wrote {output}, {output.stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
