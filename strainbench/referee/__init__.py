"""What an answer is worth, from its positions alone."""

from strainbench.referee.certificate import Certificate as Certificate
from strainbench.referee.certificate import certify as certify
