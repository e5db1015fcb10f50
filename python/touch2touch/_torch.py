"""A map-style data set for PyTorch's `DataLoader`, without a dependency on PyTorch."""


class MapDataset:
    """Items are dictionaries of arrays, named like the properties of `Pair`. Workers open the data themselves."""

    def __init__(self, data, fields):
        self.data, self.fields = data, tuple(fields)

    def __len__(self):
        return len(self.data)

    def __getitem__(self, at):
        pair = self.data[at]
        item = {field: getattr(pair, field) for field in self.fields}
        missing = [field for field, value in item.items() if value is None]
        if missing:
            raise ValueError(f"{pair.name} has no {', '.join(missing)}")
        return item | {"name": pair.name}

    def __repr__(self):
        return f"MapDataset({self.data!r}, {', '.join(self.fields)})"
