"""Parameters and launches found from measurements, and the uncertainty of results due to that of launches and
parameters.
"""
