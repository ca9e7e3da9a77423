"""Pictures of the data: trials and their scales, and raw recordings."""
