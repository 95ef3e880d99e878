"""Limits on principal stretches of volumes, after Hernandez et al. 2013: what they forbid and hold.

    python -m strainbench.studies.volumes --step 1,5,20 --resolution 2,4 -o results/volumes

measures the parts that `written.PARTS` lists, a CSV file each, and tells them in `volumes.md`.
What the folder holds of them already is kept. There are no times in it but as ratios.
"""
