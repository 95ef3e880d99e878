"""`python -m strainbench`."""

from strainbench.cli import main

if __name__ == "__main__":
    main()
