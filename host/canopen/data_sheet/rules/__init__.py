"""The rules over EDS files: text, head, lists, objects, values, PDOs, profiles."""
