"""What each part of a scene's physics changes in the answer."""

from strainbench.studies.ledger.measure import of_cloth as of_cloth
from strainbench.studies.ledger.report import write_ledger as write_ledger
from strainbench.studies.ledger.sufficient import write_enough as write_enough
