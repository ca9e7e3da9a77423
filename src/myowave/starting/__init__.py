"""What a new dataset starts from: settings for a person's forearm, a model's muscle paths, a folder of recordings.

Each command writes text that a person reads, corrects and lays over config.yaml; nothing here is used by the workflow.
"""
