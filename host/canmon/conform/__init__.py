"""Parts of `canmon conform`: source of the node, stimuli, questions, reports."""
