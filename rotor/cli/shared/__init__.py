"""What the verbs share: inputs, outputs, reports."""
