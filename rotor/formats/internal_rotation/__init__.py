"""Files of programs for internal rotation: BELGI, westerfit, XIAM."""
