"""Pictures from straight above in torch alone, without rays and without noise."""
