"""What an answer is worth, from its positions alone."""

from strainbench.referee.certificate import Certificate, certify

__all__ = ["Certificate", "certify"]
