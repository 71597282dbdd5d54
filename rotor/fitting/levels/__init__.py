"""Labelled levels and their derivatives, for the kinds of lines that a fit takes."""
