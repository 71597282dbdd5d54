"""What several verbs share: the class Verb, the course of a calculation, molecules as inputs, output files."""
