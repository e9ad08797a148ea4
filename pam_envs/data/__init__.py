"""Shipped tables of measurements and identified plants (see ``PROVENANCE.md``)."""
