"""Gases of free rigid molecules: thermal ensembles and correlation functions."""
