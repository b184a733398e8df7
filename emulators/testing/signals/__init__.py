"""Values that change by themselves: ramps, sines, noise, tables, lags, formulas."""
