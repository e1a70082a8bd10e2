"""The parts of tools/run-accuracy that are no shell: what is measured, and what comes of it."""

import argparse
import sys

import accuracy_docs
import accuracy_plan
import accuracy_report


def main():
    parser = argparse.ArgumentParser(prog="accuracy.py", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    plan = commands.add_parser("plan", help="print what to render and how to evaluate it")
    report = commands.add_parser("report", help="tables, plots and figures of what was measured")
    docs = commands.add_parser("docs", help="put tables and plots into the documentation")
    for command in (plan, report):
        command.add_argument("--quick", action="store_true")
        command.add_argument("--only", metavar="GROUP")
    report.add_argument("--results", required=True)
    report.add_argument("--out", required=True)
    docs.add_argument("--from", dest="source", required=True)
    docs.add_argument("--docs", required=True)
    arguments = parser.parse_args()

    if arguments.command == "docs":
        accuracy_docs.update(arguments.source, arguments.docs)
        return
    if arguments.only and arguments.only not in accuracy_plan.GROUPS:
        sys.exit(f"run-accuracy: '{arguments.only}' is no group; groups are "
                 + ", ".join(accuracy_plan.GROUPS))
    if arguments.command == "plan":
        for line in accuracy_plan.lines(arguments.quick, arguments.only):
            print(line)
    else:
        accuracy_report.write(accuracy_plan.make(arguments.quick, arguments.only),
                              arguments.results, arguments.out)


if __name__ == "__main__":
    main()
