"""An infra-red reader of ucodes, and the markers in its environment that send them."""
