"""``python -m chutelab`` does what the command ``chutelab`` does."""

from chutelab.cli import main

if __name__ == "__main__":
    main()
