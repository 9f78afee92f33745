"""Drives bounce and bounced through whatever every technique must hold: see README.md here."""
