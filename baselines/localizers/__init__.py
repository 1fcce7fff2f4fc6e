"""The five end-to-end localizers; ``registry`` names them without torch and builds them."""
