"""Which finger is the default: published facts of touch, replayed for skins of several kinds."""
